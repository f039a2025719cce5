"""VTK: OpenGL without a window, physically based materials under one light."""

import numpy as np
import vtkmodules.all as vtk
from view_loop import opened
from vtkmodules.util.numpy_support import vtk_to_numpy

scene = opened()
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(True)
window.SetMultiSamples(0)
window.SetSize(*scene.size)
renderer = vtk.vtkRenderer()
window.AddRenderer(renderer)
importer = vtk.vtkGLTFImporter()
importer.SetFileName(scene.path("model.glb"))
importer.SetRenderWindow(window)
importer.Update()
renderer = window.GetRenderers().GetFirstRenderer()
plane = vtk.vtkPLYReader()
plane.SetFileName(scene.path("ground.ply"))
mapper = vtk.vtkPolyDataMapper()
mapper.SetInputConnection(plane.GetOutputPort())
ground = vtk.vtkActor()
ground.SetMapper(mapper)
ground.GetProperty().SetInterpolationToPBR()
renderer.AddActor(ground)
renderer.RemoveAllLights()
sun = vtk.vtkLight()
sun.SetPosition(*scene.told["sun"])
sun.SetFocalPoint(0, 0, 0)
sun.SetIntensity(3)
renderer.AddLight(sun)
renderer.SetBackground(0.4, 0.6, 0.9)
camera = renderer.GetActiveCamera()
camera.SetViewAngle(np.rad2deg(scene.told["fov_y"]))
color, depth = vtk.vtkUnsignedCharArray(), vtk.vtkFloatArray()
width, height = scene.size
scene.ready(f"VTK {vtk.vtkVersion().GetVTKVersion()}", "colour under one light, depth; no shadows, sky or labels")
for view in scene.views():
    matrix = np.array(scene.told["views"][view])
    camera.SetPosition(*matrix[:3, 3])
    camera.SetFocalPoint(*(matrix[:3, 3] - matrix[:3, 2]))
    camera.SetViewUp(*matrix[:3, 1])
    renderer.ResetCameraClippingRange()
    window.Render()
    window.GetPixelData(0, 0, width - 1, height - 1, 0, color, 0)
    window.GetZbufferData(0, 0, width - 1, height - 1, depth)
    scene.keep(view, vtk_to_numpy(color).reshape(height, width, 3)[::-1])
