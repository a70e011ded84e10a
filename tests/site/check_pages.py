"""check_pages.py SITE LEXICON/ENTRY...: every page is well-formed XML, has its parts, and links to what is there."""
import base64, json, os, re, struct, sys
import xml.etree.ElementTree as ET

site, entries = sys.argv[1], sys.argv[2:]
wrong = []


def say(path, what):
    wrong.append(f"{path}: {what}")


def local(tag):
    return tag.split("}")[-1]


pages = {}
for folder, _, files in os.walk(site):
    for name in files:
        if name.endswith(".html"):
            path = os.path.relpath(os.path.join(folder, name), site)
            text = open(os.path.join(site, path), encoding="utf-8").read()
            assert text.startswith("<!DOCTYPE html>\n"), path
            try:
                pages[path] = ET.fromstring(text.split("\n", 1)[1])
            except ET.ParseError as error:
                say(path, f"is not well formed: {error}")

ids_wanted = {f"{e}.html" for e in entries} | {"index.html"}
if set(pages) != ids_wanted:
    say(site, f"has the pages {sorted(pages)}")

for path, page in pages.items():
    seen, levels = set(), []
    for node in page.iter():
        tag = local(node.tag)
        for name in ("href", "src"):
            target = node.get(name)
            if target is None or target.startswith(("#", "data:,")):
                continue
            if re.match(r"[a-z]+:", target) or target.startswith("/"):
                say(path, f"asks for {target}")
            elif not os.path.isfile(os.path.join(site, os.path.dirname(path), target)):
                say(path, f"links to {target}, which is not there")
        if node.get("id"):
            if node.get("id") in seen:
                say(path, f"has id {node.get('id')} twice")
            seen.add(node.get("id"))
        if tag == "img" and node.get("alt") is None:
            say(path, "has a picture without alt")
        if tag in ("h1", "h2", "h3"):
            levels.append(int(tag[1]))
        if tag in ("script", "style") and node.get("src") is None:
            say(path, "has a script in itself")
        if any(name.startswith("on") for name in node.attrib):
            say(path, f"has a handler on <{tag}>")
        if tag in ("input", "select", "button", "a") and not "".join(node.itertext()).strip():
            labelled = any(local(p.tag) == "label" and node in list(p.iter()) and "".join(p.itertext()).strip() for p in page.iter())
            if not labelled:
                say(path, f"has an unnamed <{tag}>")
    if levels[:1] != [1] or levels.count(1) != 1:
        say(path, f"has headings {levels}")
    if any(b > a + 1 for a, b in zip(levels, levels[1:])):
        say(path, f"leaves out a level of headings: {levels}")
    if page.get("lang") != "en":
        say(path, "names no language")

text = lambda path: "".join(pages[path].itertext())
for e in entries:
    path, (lexicon, name) = f"{e}.html", e.split("/")
    canvas = next(n for n in pages[path].iter() if local(n.tag) == "canvas")
    if canvas.get("data-clip") != name or name not in canvas.get("aria-label", ""):
        say(path, f"plays {canvas.attrib}")
    for part in ("What moves, and when", "As it is written", "Sources", "Tests that play it", f"entry {name}"):
        if part not in text(path):
            say(path, f"has no {part!r}")
for i, e in enumerate(entries):
    rel = {n.get("rel"): n.get("href") for n in pages[f"{e}.html"].iter() if n.get("rel") in ("prev", "next")}
    lexicon = e.split("/")[0]
    before = entries[i - 1].split("/")[1] + ".html" if i and entries[i - 1].startswith(lexicon + "/") else None
    if rel.get("prev") != before:
        say(e, f"has {rel} around it")
cards = [n for n in pages["index.html"].iter() if n.get("data-search") is not None]
if len(cards) != len(entries):
    say("index.html", f"lists {len(cards)} entries")

# What the sources say stands there as text, whatever it is made of.
ask = text("small/ask.html")
for said in ("<script>alert(1)</script> & more.", "a question & its </title> end", '<b>bold</b>', 'a "quoted" one',
             "http://example.org/?a=1&b=2", "another work cites the first source", "ask <i>lowers</i> the brow & no more",
             '// "</pre>"', "// </code></pre>", "AU4 Brow Lowerer", "AU57 head thrust"):
    if said not in ask:
        say("small/ask.html", f"does not say {said}")
if "AU4 Brow" in text("small/looks_ahead.html") or "it holds the face as it is" not in text("small/looks_ahead.html"):
    say("small/looks_ahead.html", "moves something")

# The face is a GLB with every entry's clip.
for lexicon in {e.split("/")[0] for e in entries}:
    script = open(f"{site}/{lexicon}/face.js", encoding="ascii").read()
    glb = base64.b64decode(re.fullmatch(r'window\.nmsFace = "([A-Za-z0-9+/=]*)";\n', script).group(1), validate=True)
    length = struct.unpack("<I", glb[12:16])[0]
    clips = {a["name"] for a in json.loads(glb[20 : 20 + length])["animations"]}
    wanted = {e.split("/")[1] for e in entries if e.startswith(lexicon + "/")}
    if struct.unpack("<4sII", glb[:12]) != (b"glTF", 2, len(glb)) or clips != wanted:
        say(f"{lexicon}/face.js", f"has the clips {clips}")

for line in wrong:
    print(f"wrong: {line}")
sys.exit(1 if wrong else 0)
