"""Flight of a body: centre of mass, angular momentum, take-off and landing."""
