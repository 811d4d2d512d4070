"""A recorded scene as one HTML page that asks no network for anything."""

from base64 import b64encode
from html import escape

from tutorialbot.viewers.assets import front_end, script
from tutorialbot.viewers.log import Key, pack

TEMPLATE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<!-- Contains meshcat's viewer (MIT licence, Robin Deits) with three.js, dat.gui and others, each under its own. -->
<style>html,body,#scene{{margin:0;height:100%}}</style></head>
<body><div id="scene"></div>
<script type="application/octet-stream" id="code">{code}</script>
<script type="application/octet-stream" id="data">{data}</script>
<script type="module">
{unpack}const bytes = (id) => Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
const api = await unpackFrontEnd(bytes("code"));
const store = new api.Store(() => {{}});
await store.load(bytes("data"));
new api.SceneView(document.getElementById("scene"), store);
</script></body></html>
"""


def build(view: dict, entries: dict[Key, bytes], title: str) -> str:
    """Return the page of the commands `entries`, seen as `view` says; it fills its window."""
    data = pack({"sequence": 0, "view": {**view, "height": None}}, entries)
    texts = {"unpack": script("unpack"), "code": b64encode(front_end()).decode(), "data": b64encode(data).decode()}
    return TEMPLATE.format(title=escape(title), **texts)


def frame(page: str, height: int) -> str:
    """Return an iframe of `height` [px] that holds the page itself, for a notebook's output."""
    style = f"width:100%;height:{height}px;border:0;border-radius:6px"
    return f'<iframe srcdoc="{escape(page, quote=True)}" style="{style}"></iframe>'
