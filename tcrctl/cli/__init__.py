"""The command line: one verb one file, each a plain function; heavy imports inside the function."""
