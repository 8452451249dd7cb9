"""What design.md defines, computed a second time, slowly and plainly, for tests to compare with."""
