"""The page at the root of the server: what it offers, in plain HTML without a script."""

from html import escape

from avlmaps.core.version import __version__
from avlmaps.serve.openapi import document
from avlmaps.serve.operations import OPERATIONS

CONTENT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'"
_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#26292e;background:#fff}
code,pre{font:14px/1.4 ui-monospace,monospace;background:#f6f5f1;border-radius:4px}
code{padding:.1em .3em}pre{padding:.8em;overflow:auto}
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.3em .6em}
th,td{border-top:1px solid #ddd;vertical-align:top}
h2{margin-top:2rem}h3{margin-bottom:.2rem}
@media(prefers-color-scheme:dark){body{background:#16181b;color:#e4e2dc}code,pre{background:#22252a}
th,td{border-color:#3a3d42}}
"""


def html_page(address: str) -> str:
    """Return the page of the server at an address, such as ``http://127.0.0.1:8750``."""
    described = document([], "", False)
    sections = "\n".join(
        _section(path, method.upper(), operation)
        for path, item in described["paths"].items()
        for method, operation in item.items()
    )
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<title>avlmaps server</title><style>{_STYLE}</style></head><body>
<h1>avlmaps server</h1>
<p>Version {escape(__version__)}, {len(OPERATIONS)} operations on each map. The maps: <a href="maps">maps</a>.
In the browser, a map is at <code>/maps/NAME/view</code>.
For programs: <a href="openapi.json">openapi.json</a> (OpenAPI 3.1). For agents: MCP by streamable HTTP at
<code>/mcp</code>.</p>
<pre>curl -G {escape(address)}/maps/NAME/ask --data-urlencode "sentence=the chair near the table"
curl -F photo=@photo.jpg {escape(address)}/maps/NAME/locate</pre>
<p>Answers are the JSON that the command line prints under <code>--json</code>. Errors are
<code>{{"error": {{"kind": ..., "message": ...}}}}</code>. Send <code>Accept: text/event-stream</code> for the
progress of work that takes long.</p>
<h2>Operations</h2>
{sections}
</body></html>
"""


def _section(path: str, method: str, operation: dict) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(one['name'])}</code></td><td>{escape(one['in'])}</td>"
        f"<td>{'required' if one['required'] else ''}</td><td>{escape(one.get('description', ''))}</td></tr>"
        for one in operation.get("parameters", [])
    )
    table = f"<table><tr><th>value</th><th>in</th><th></th><th></th></tr>{rows}</table>" if rows else ""
    bodies = ", ".join(operation.get("requestBody", {}).get("content", {}))
    body = f"<p>Body: <code>{escape(bodies)}</code></p>" if bodies else ""
    more = f"<pre>{escape(operation['description'])}</pre>" if "description" in operation else ""
    return f"<h3><code>{method} {escape(path)}</code></h3><p>{escape(operation['summary'])}</p>{table}{body}{more}"
