"""The files of a run's folder, by their names below it."""


def files_of(folder):
    """Every file below a folder, as text: `motion.csv`, `tables/angles.csv`."""
    return {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}


def contents_of(folder):
    """Every file below a folder with its bytes."""
    return {name: path.read_bytes() for name, path in files_of(folder).items()}
