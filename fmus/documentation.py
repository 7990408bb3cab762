def page(model, key): return "<html></html>"
def icon(name): return b""
