"""Exported models applied to maps. No training code, no ompl."""
