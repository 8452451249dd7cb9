"""The wing: what stands beside the mission. Nothing outside imports it."""
