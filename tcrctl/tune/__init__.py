"""``tcrctl tune``: settings that make the worst runs better, found on some plants and judged on others.

study with ranges -> candidates of CMA-ES -> their runs, in the study's store -> worst decile -> next candidates
-> the best one against what is shipped, on plants that nobody has seen -> an experiment file, or: it stands
"""
