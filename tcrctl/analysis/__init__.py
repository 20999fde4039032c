"""What a log tells afterwards: histories, a drawing's lines, contents, differences, tables."""
