"""`python -m hybridnav` is the command line."""

from hybridnav.cli import main

main()
