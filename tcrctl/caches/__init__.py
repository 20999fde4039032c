"""What may be lost at any time and only saves time: compiled kernels, and matplotlib's list of fonts.

hook (when numba or matplotlib is loaded) -> kernel_cache (one kernel) -> kernel_folder -> kernel_sources, places
                                          -> fonts -> places
"""
