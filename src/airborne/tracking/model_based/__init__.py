"""`refined` and its kin: the drawn body is compared with the pictures and moved by Gauss-Newton steps."""
