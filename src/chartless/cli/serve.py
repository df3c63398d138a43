"""``chartless serve``: the page for who does not like a terminal."""

from typing import Annotated

import typer


def serve(
    host: Annotated[
        str, typer.Option(help="Address to listen on; any but this computer's requires a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
    most_megabytes: Annotated[
        int, typer.Option(min=1, help="Size of all files of a browser, at most.")
    ] = 4096,
) -> None:
    """Open a page on which frames become curves.

    Files are kept on this computer, and each browser sees only its own. Stop it with Ctrl-C; then
    they are removed. With another --host than this computer's own, others on the network who have
    the address with its token can send files here, over a connection that is not encrypted.

    \b
    Example:
        chartless serve
        chartless serve --port 8000 --no-browser
        chartless serve --host 0.0.0.0 --port 8000
    """
    from chartless.web import Limits
    from chartless.web import serve as serve_page

    size = most_megabytes * 10**6
    limits = Limits(file_bytes=size, total_bytes=size)
    serve_page(host=host, port=port, browser=browser, limits=limits, on_start=_announce)
    print("stopped")


def _announce(address: str) -> None:
    print(f"page at {address}")
    if "?token=" in address:  # which it has wherever others reach it
        print(
            "others on the network who have this address can send files here, unencrypted\n"
            "files are kept on this computer until it stops"
        )
    print("press Ctrl-C to stop", flush=True)
