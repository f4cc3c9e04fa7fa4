"""OMPL: planners that sample from a heat map. Nothing else imports ompl."""
