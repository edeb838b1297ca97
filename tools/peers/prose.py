"""Lines of Markdown for docs/results: paragraphs wrapped, all else as it is."""

import re
import textwrap

WIDTH = 100


def wrapped(text):
    """Paragraphs and list items wrapped at WIDTH letters; tables, headings, pictures and code keep their lines."""
    out, paragraph = [], []

    def flush():
        if paragraph:
            item = re.match(r"\s*([-*]|\d+\.)\s+", paragraph[0])
            indent = " " * len(item.group(0)) if item else ""
            # Spaces in code stay: no line ends there.
            joined = re.sub(r"`[^`]*`", lambda m: m.group(0).replace(" ", "\0"), " ".join(line.strip() for line in paragraph))
            lines = textwrap.wrap(joined, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
            out.extend(line.replace("\0", " ") for line in lines)
            paragraph.clear()

    for line in text.split("\n"):
        if not line.strip() or line.startswith(("|", "#", "!", "    ", "`{")):
            flush()
            out.append(line)
            continue
        if re.match(r"\s*([-*]|\d+\.)\s", line):
            flush()
        paragraph.append(line)
    flush()
    return "\n".join(out)
