"""own_effect.py: later"""
OwnEffect = None
