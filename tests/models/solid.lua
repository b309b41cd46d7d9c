-- One floating body of each kind, with a position and a turn in the link: the option `kind` selects it.
local rd = require "refdyn"
local kind = rd.option("kind", "box")
local at, turn = { 0.3, -0.2, 0.5 }, { { "z", 0.4 }, { "x", -0.7 } }
local bodies = {
  box = rd.box { { 0.3, 0.2, 0.1 }, density = 1200, at = at, turn = turn },
  cylinder_x = rd.cylinder { diameter = 0.2, length = 0.5, density = 1200, at = at, turn = turn },
  cylinder_y = rd.cylinder { diameter = 0.2, length = 0.5, density = 1200, axis = "y", at = at, turn = turn },
  tube_z = rd.tube { outer = 0.2, inner = 0.15, length = 0.5, density = 1200, axis = "z", at = at, turn = turn },
  sphere = rd.sphere { diameter = 0.3, density = 1200, at = at, turn = turn },
  data = { mass = 3, center = { 0.1, 0, -0.2 }, at = at, turn = turn,
           inertia = { xx = 0.05, yy = 0.07, zz = 0.06, xy = 0.005, xz = -0.004, yz = 0.003 } },
}

return rd.model { name = "solid", links = { { "body", joint = "free", bodies = { bodies[kind] } } } }
