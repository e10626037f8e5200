"""A decoder of .tag files, written from docs/dev/format.md alone to test that document. It is slow, for small files only."""
