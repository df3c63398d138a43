"""Raw files beside the JPEGs that the camera made of them: the light itself is known."""
