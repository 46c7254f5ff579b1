"""The tracker `blocker`: a chain of rigid trunk and legs that is fitted to evidence maps of every camera.

In come frames and the joints of the first one; out come joints with covariances. Jumps and tables are left to others.
"""

from airborne.tracking.capsules.tracker import Blocker

__all__ = ["Blocker"]
