"""The native closed loops, one engine a file, and what they share."""
