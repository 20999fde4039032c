"""What the tests share: fakes, makers of data, independent judges."""
