"""Entry of the command line: ``bingham`` and ``python -m bingham``."""

from __future__ import annotations

from bingham.errors import MissingExtraError

__all__ = ["main"]


def main() -> None:
    """Run the command line; without its packages, say how to get them."""
    try:
        from bingham.cli.main import main as run
    except ModuleNotFoundError as error:
        if error.name not in ("typer", "rich"):
            raise
        raise SystemExit(str(MissingExtraError(error.name, "cli", "the command line"))) from None
    run()


if __name__ == "__main__":
    main()
