"""results.py: later"""
