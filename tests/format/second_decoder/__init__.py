"""A decoder of .tag files written from docs/format.md alone. Slow; for small files and for the document's sake."""
