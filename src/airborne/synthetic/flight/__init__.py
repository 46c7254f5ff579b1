"""Free flight with a known truth: of rigid bodies, of people who move their joints, and paper B's somersault."""
