"""The derivation compared with the printed paper (`capsule_sym._paper`), statement by statement."""
