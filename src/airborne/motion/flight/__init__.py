"""Flight of a body: centre of mass, angular momentum, and when it leaves the floor."""
