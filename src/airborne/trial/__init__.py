"""The trial: one recording as one TOML file, its tables and where the bundled examples lie; opens no video."""
