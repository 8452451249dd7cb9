"""The command line `hybridnav`."""


def main() -> None:
    """Run the command line."""
    from hybridnav.cli.app import main as run  # noqa: PLC0415 - the package imports light

    run()
