"""`refined`, `hierarchical`, `joint`: the rendered body is compared with the images and moved by Gauss-Newton steps."""
