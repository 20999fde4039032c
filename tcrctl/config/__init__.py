"""Files that people write: strict YAML, validated settings, mistakes in plain words, shipped files by name."""
