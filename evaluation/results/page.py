def write_page(results, queries, folder, **k):
    p = folder / "index.html"
    p.write_text("x")
    return p
