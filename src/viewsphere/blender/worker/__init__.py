"""The program that holds Blender: the standard library, numpy and bpy only; another interpreter runs it."""
