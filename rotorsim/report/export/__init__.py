"""Files of the figures of a page (PNG, SVG, CSV), and the browsers that show pages and draw figures."""
