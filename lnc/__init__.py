"""The compiler of lighting networks: text in, one C++ program out."""

__version__ = "0.1.0"
