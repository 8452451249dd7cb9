"""The definitions of the pages, computed a second time, slowly and plainly, to compare with."""
