"""``tcrctl workspace``: where the end of a robot can be with taut cables, by statics along rays of drives.

directions (Sobol) -> rays from rest until something ends them -> poses -> table, figure, point cloud
"""
