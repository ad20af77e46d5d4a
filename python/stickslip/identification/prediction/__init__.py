"""The motion that a law makes, predicted or laid beside the measured one."""
