from hypothesis import settings

# Wall-clock limits on single examples measure how busy the machine is, not the code.
settings.register_profile("capsule-sym", deadline=None)
settings.load_profile("capsule-sym")
