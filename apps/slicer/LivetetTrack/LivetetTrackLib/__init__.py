"""The part of the module LivetetTrack that needs no Slicer."""
