"""Kinds from elsewhere: installed packages that register them, modules, and files beside an experiment."""
