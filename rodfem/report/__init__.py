"""A report on a diagram: one HTML file to look at, made from the files of a run alone.

``page`` puts it together, ``payload`` collects its data, and ``static`` holds its template, style and ES modules.
``static/vendor`` has plotly.js and three.js with their licences.
"""
