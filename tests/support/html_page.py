"""An HTML page taken apart: tables, images, links, text."""

from html.parser import HTMLParser

#: elements without an end
VOID = {"meta", "img", "br", "link"}
#: attributes that load something
LOADING = {"src", "srcset", "data", "poster", "background", "action", "xlink:href"}


class Page(HTMLParser):
    """Tables by id, images, links, text; raises on elements that are not closed."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.images, self.links, self.loaded = {}, [], [], []
        self.ids, self.text, self.names = [], "", set()
        self._open, self._table, self._cell = [], None, None
        self.feed(text)
        assert self._open == []

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.names.add(tag)
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.loaded += [(tag, name, value) for name, value in attrs if name in LOADING]
        if tag not in VOID:
            self._open.append(tag)
        if tag == "a":
            self.links.append(attributes["href"])
        elif "href" in attributes:
            self.loaded.append((tag, "href", attributes["href"]))
        if tag == "img":
            self.images.append(attributes)
        elif tag == "table":
            self._table = self.tables.setdefault(attributes["id"], [])
        elif tag == "tr":
            self._table.append([])
        elif tag in ("td", "th"):
            self._table[-1].append("")
            self._cell = True

    def handle_endtag(self, tag):
        assert self._open.pop() == tag
        if tag in ("td", "th"):
            self._cell = None

    def handle_data(self, data):
        if self._open and self._open[-1] != "style":
            self.text += data
        if self._cell:
            self._table[-1][-1] += data
