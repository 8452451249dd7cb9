"""Tables that subjects print, and how busy the machine is."""

import os


def print_head(*columns: str) -> None:
    """Print the head of a table in Markdown."""
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")


def print_row(*cells: object) -> None:
    """Print a row of a table in Markdown."""
    print(f"| {' | '.join(map(str, cells))} |", flush=True)


def print_load() -> None:
    """Print how busy the machine is: a busy one stretches every time."""
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}", flush=True)
