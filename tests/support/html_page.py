"""An HTML page taken apart: tables, images, links, text."""

from lxml import html

#: attributes that load something
LOADING = ("src", "srcset", "data", "poster", "background", "action")


class Page:
    """Tables by id, images, links, what is loaded, ids, names of the elements, text."""

    def __init__(self, text):
        root = html.document_fromstring(text)
        nodes = [node for node in root.iter() if isinstance(node.tag, str)]
        self.tables = {
            table.get("id"): [[cell.text_content() for cell in row] for row in table.iter("tr")]
            for table in root.iter("table")
        }
        self.images = [dict(node.attrib) for node in root.iter("img")]
        self.links = [node.get("href") for node in root.iter("a")]
        self.loaded = [
            (node.tag, name, value)
            for node in nodes
            for name, value in node.items()
            if name in LOADING or (name == "href" and node.tag != "a")
        ]
        self.ids = [node.get("id") for node in nodes if node.get("id")]
        self.names = {node.tag for node in nodes}
        self.text = "".join(root.xpath("//text()[not(ancestor::style)]"))
