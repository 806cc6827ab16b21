"""The derivation beside the printed paper (`capsule_sym.paper`), statement by statement."""
