"""What changes the positions of tracks after they were followed: markers that met, the camera, the noise."""
