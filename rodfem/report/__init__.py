"""A report on a diagram: one HTML file to look at, made from the files of a run alone.

``static`` has its template, style and ES modules, ``static/vendor`` plotly.js and three.js with their licences.
"""
