"""Damaged and hostile files: what a reader makes of them, or its one line."""

import hybridnav as hn


def reader(load, folder):
    """Return what reads a file of some content with a loader: the result, or the error's text."""

    def read(name, content):
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        try:
            return load(path)
        except hn.errors.MapError as error:
            text = str(error)
        assert text.isprintable()
        assert name in text
        assert len(text) < 500 + len(str(folder))
        return text

    return read
