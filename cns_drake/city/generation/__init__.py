"""From a folder of YAML files to the stages of a city as SDF."""
