"""``tcrctl paper``: the paper's experiments, run again and held against its figures.

table (data) -> jobs, in worker processes -> results -> verdicts -> Markdown, JSON
"""
