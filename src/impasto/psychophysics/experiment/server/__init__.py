"""The server of an experiment: interfaces for the page and for the laboratory, and the pages themselves."""
