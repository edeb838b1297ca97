#!/usr/bin/env python3
"""Writes kanagata/scene_types.py, the types of a scene file, from its JSON schema.

    make_types.py SCHEMA [OUTPUT]       without OUTPUT to standard output
"""

import json
import keyword
import re
import sys
import textwrap

BASIC = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None", "object": "dict[str, Any]"}


def type_of(schema, name, out):
    """Type expression of a schema. An object within gets a type of its own, called ``name``, which is added to ``out``."""
    if schema is True or not schema:
        return "Any"
    if "$ref" in schema:
        return '"' + schema["$ref"].rsplit("/", 1)[1] + '"'
    if "const" in schema:
        return f"Literal[{schema['const']!r}]"
    if "enum" in schema:
        return "Literal[" + ", ".join(repr(v) for v in schema["enum"]) + "]"
    for key in ("oneOf", "anyOf"):
        if key in schema:
            return union(schema[key], name, out)
    if "allOf" in schema:
        return type_of(schema["allOf"][0], name, out)
    kind = schema.get("type")
    if isinstance(kind, list):
        return union([{**schema, "type": k} for k in kind], name, out)
    if kind == "array":
        items = schema.get("items")
        return f"list[{type_of(items, name + 'Item', out)}]" if items else "list[Any]"
    if kind == "object" and "properties" in schema:
        out += ["", ""] + typed_dict(name, schema, out)
        return f'"{name}"'
    return BASIC.get(kind, "Any")


def union(options, name, out):
    """Type expression of one of several."""
    names = [f"{name}{of_keys(option) or k}" for k, option in enumerate(options, 1)]
    types = list(dict.fromkeys(type_of(option, own, out) for option, own in zip(options, names)))
    return types[0] if len(types) == 1 else f"Union[{', '.join(types)}]"


def of_keys(schema):
    """The only required key of an object in camel case; nothing for other forms."""
    required = schema.get("required", []) if isinstance(schema, dict) else []
    return camel(required[0]) if len(required) == 1 else ""


def camel(key):
    """A key as part of the name of a type."""
    return "".join(part.capitalize() for part in re.split("[^A-Za-z0-9]+", key))


def comment(schema, indent):
    """The description as comment lines."""
    text = " ".join(schema.get("description", "").split())
    return textwrap.wrap(text, 110, initial_indent=indent + "# ", subsequent_indent=indent + "# ")


def typed_dict(name, schema, out):
    """Lines of a typed dictionary; a functional one where a key is no name."""
    required = set(schema.get("required", []))
    lines = []
    fields = []
    for key, value in schema["properties"].items():
        kind = type_of(value, name + camel(key), out)
        fields.append((key, kind if key in required else f"NotRequired[{kind}]", value))
    if any(not key.isidentifier() or keyword.iskeyword(key) for key, _, _ in fields):
        lines += comment(schema, "")
        lines += [f"{name} = TypedDict(", f'    "{name}",', "    {"]
        for key, kind, value in fields:
            lines += comment(value, "        ") + [f'        "{key}": {kind},']
        return lines + ["    },", ")"]
    lines += [f"class {name}(TypedDict):"]
    text = " ".join(schema.get("description", name).split())
    lines += textwrap.wrap(f'"""{text}"""', 110, initial_indent="    ", subsequent_indent="    ") + [""]
    for key, kind, value in fields:
        lines += comment(value, "    ") + [f"    {key}: {kind}"]
    return lines


def main(schema_path, output=None):
    schema = json.load(open(schema_path, encoding="utf-8"))
    out = [
        '"""Types of a scene file; written by make_types.py from schemas/scene.schema.json."""',
        "",
        "from typing import Any, Literal, NotRequired, TypedDict, Union",
    ]
    for name, definition in schema["$defs"].items():
        if definition.get("type") == "object" and "properties" in definition:
            lines = typed_dict(name, definition, out)
        else:
            lines = comment(definition, "") + [f"{name} = {type_of(definition, name, out)}"]
        out += ["", ""] + lines
    lines = typed_dict("SceneFile", schema, out)
    out += ["", ""] + lines
    text = "\n".join(out) + "\n"
    if output is None:
        sys.stdout.write(text)
    else:
        with open(output, "w", encoding="utf-8") as file:
            file.write(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
