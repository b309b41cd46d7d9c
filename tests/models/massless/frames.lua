-- Massless frames that rows determine, with singular M:
--   four_bar   coupler and rocker have no mass, so that the crank is a pendulum, 0.09 psi'' = 0.2 (-0.7 sin(psi) - 9.81 cos(psi));
--              --start project closes the loop
--   slides     a has no mass and carries b, M = m [[1, 1], [1, 1]] for the two; a row ties a to half of b and
--              to c. x = a + b moves as a free mass: a alone adapts to the row, which does not affect x
--   rates      the same with a velocity row
--   free       the row does not contain a: nothing determines its acceleration
--   rod        a flexible arm drives a mass on a slide through a massless rod
local rd = require "refdyn"
local scene = rd.option("scene", "four_bar", { "four_bar", "slides", "rates", "free", "rod" })
local n_rfe = rd.option("n_rfe", 4)

local function four_bar()
  return {
    links = {
      { "crank", joint = "psi", start = { psi = 1 }, start_rate = { psi = 0.7 }, mass = 1, center = { 0.2, 0, 0 }, inertia = { zz = 0.05 } },
      { "coupler", on = "crank", at = { 0.3, 0, 0 }, joint = "psi", start = { psi = -0.6 } },
      { "rocker", at = { 0.8, 0, 0 }, joint = "psi", start = { psi = 1.2 } },
    },
    points = { pin = { on = "coupler", at = { 0.8, 0, 0 } } },
    rows = function() return { rd.loop { "pin", { on = "rocker", at = { 0.35, 0, 0 } }, keep = "x, y", alpha = 20, beta = 20 } } end,
  }
end

local function slides()
  return {
    links = {
      { "a", joint = "x", start = { x = 0.3 } },
      { "b", on = "a", joint = "x", start = { x = 0.6 }, start_rate = { x = 0.4 }, mass = 1.7 },
      { "c", joint = "y", start = { y = 0.1 }, mass = 0.9 },
    },
    rows = function(s)
      local a, b, c = s.q.a_x, s.q.b_x, s.q.c_y
      if scene == "slides" then return { rd.position { a - 0.5 * b + 0.2 * c - 0.02, alpha = 20, beta = 20 } } end
      if scene == "rates" then return { rd.velocity { s.qd.a_x - 0.5 * s.qd.b_x, alpha = 20 } } end
      return { rd.position { c - 0.1, alpha = 20, beta = 20 } }
    end,
  }
end

local function rod()
  return {
    links = {
      { "arm", joint = "psi", start = { psi = 0.2 },
        beam = { length = 1, section = rd.round(0.02), E = 2e9, nu = 0.3, rho = 1000, eta = 1e-3, rfe = n_rfe, dofs = "psi" } },
      { "rod", on = "arm.tip", joint = "psi", start = { psi = -1 } },
      { "car", joint = "x", start = { x = 1.4 }, mass = 0.7 },
    },
    points = { pin = { on = "rod", at = { 0.5, 0, 0 } }, car = "car" },
    rows = function() return { rd.loop { "pin", { on = "car" }, keep = "x, y", alpha = 20, beta = 20 } } end,
  }
end

local chosen = scene == "four_bar" and four_bar() or scene == "rod" and rod() or slides()
return rd.model {
  name = "massless_frames", gravity = { 0.7, -9.81, 0 }, links = chosen.links, points = chosen.points,
  constraints = chosen.rows,
}
