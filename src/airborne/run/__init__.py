"""One recording from files to results: opening, first pose, tracking, tables and report; resumed where it stopped."""
