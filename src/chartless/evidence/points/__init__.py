"""Measured points of the curve: a chart's patches, a step wedge, exposures of a uniform light."""
