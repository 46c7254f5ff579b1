"""The studio's pages, one file each; what they share is in `layout` and `slow_work`."""
