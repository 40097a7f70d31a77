"""The picture of a palette: its timeline, frames and polyhedra (figures 1 and 8 of the paper).

`layout` decides which row a palette vertex stands in, `panel` where rows and times are; `timeline`,
`discs` and `polyhedron` draw, `figure` joins them to one page, `style` holds colours and sizes.
matplotlib is imported here and nowhere else in the package; no global state of it is touched.
"""
