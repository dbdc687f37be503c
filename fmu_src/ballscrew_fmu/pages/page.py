"""What the pages of the documentation of several FMUs share: head with title {name}, table of variables {rows}."""

HEAD = """\
<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{name}</title>
<style>body {{ font-family: sans-serif; max-width: 60em; margin: auto; padding: 1em }}
table {{ border-collapse: collapse }} td, th {{ border: 1px solid #999; padding: 0.2em 0.5em }}
img {{ max-width: 100% }}</style></head>
<body>
<h1>{name}</h1>
"""
VARIABLES = """\
<h2>Variables</h2>
<table>
<tr><th>name</th><th>kind</th><th>unit</th><th>start</th><th>min</th><th>max</th><th>meaning</th></tr>
{rows}
</table>
</body>
</html>
"""
