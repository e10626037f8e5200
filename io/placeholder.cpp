namespace tagrid {}
