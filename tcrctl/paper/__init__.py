"""``tcrctl paper``: the paper's experiments, run again and held against its figures.

table (data) -> jobs, each a process of its own -> results -> verdicts -> Markdown, JSON
"""
