-- Prepended to a model, this file puts it on a seat that is turned in space: `seat` replaces the ground, the seat's axes replace the
-- ground's, and the weight turns alike. The seat is fixed, or on a base that yaws and pitches, freely or driven.
do
  local rd = require "refdyn"
  local base = rd.option("seat_base", "fixed", { "fixed", "free", "driven" })
  local factor = rd.option("seat_factor", 1.0)  -- of all rows of rd.position, rd.velocity, rd.acceleration
  local turns = {}
  for i, axis in ipairs { "x", "y", "z" } do turns[i] = { axis, rd.option("seat_" .. axis, 0.0) } end
  local plain = {}
  for name, value in pairs(rd) do plain[name] = value end

  -- The vector v of the seat's axes in those of the ground.
  local function turned(v)
    local x, y, z = v[1], v[2], v[3]
    local function turn(a, b, angle) return math.cos(angle) * a - math.sin(angle) * b, math.sin(angle) * a + math.cos(angle) * b end
    x, y = turn(x, y, turns[3][2])
    z, x = turn(z, x, turns[2][2])
    y, z = turn(y, z, turns[1][2])
    return { x, y, z }
  end

  -- A copy of a table of the author in which the seat replaces the ground.
  local function seated(value)
    if value == "ground" then return "seat" end
    if type(value) ~= "table" or getmetatable(value) then return value end
    local copy = {}
    for k, v in pairs(value) do copy[k] = seated(v) end
    return copy
  end

  -- ---- The state in the axes of the seat ----

  local letters = { "x", "y", "z" }

  -- A table whose fields are computed when they are read.
  local function computed(field)
    return setmetatable({}, { __index = function(_, name) return field(name) end })
  end
  local function difference(a, b)
    return computed(function(name) return a[name] - b[name] end)
  end
  local function dot(a, of_a, b, of_b)
    local sum = 0
    for _, x in ipairs(letters) do sum = sum + a[x .. of_a] * b[x .. of_b] end
    return sum
  end

  -- The components of a vector with the fields x, xd, xdd ... along the seat's axes, and their derivatives in time.
  local function in_seat(v, seat)
    return computed(function(name)
      local axis, order = name:match "^([xyz])(d*)$"
      local e = seat[axis]
      if order == "" then return dot(e, "", v, "") end
      if order == "d" then return dot(e, "", v, "d") + dot(e, "d", v, "") end
      return dot(e, "", v, "dd") + 2 * dot(e, "d", v, "d") + dot(e, "dd", v, "")
    end)
  end
  -- The angular velocity relative to the seat, and its derivative.
  local function spin_in_seat(of, seat, name)
    local w = computed(function(field) return of["w" .. field] - seat["w" .. field] end)
    return in_seat(w, seat)[name:sub(2)]
  end
  local function axes_in_seat(axes, seat)
    return computed(function(name) return name:match "^w" and spin_in_seat(axes, seat, name) or in_seat(axes[name], seat) end)
  end
  local function point_in_seat(point, origin, seat)
    local moved = in_seat(difference(point, origin), seat)
    return computed(function(name)
      if name == "axes" then return axes_in_seat(point.axes, seat) end
      return name:match "^w" and spin_in_seat(point, seat, name) or moved[name]
    end)
  end
  local function state_in_seat(s)
    local seat = s.axes.seat
    local fields = {
      points = computed(function(name) return point_in_seat(s.points[name], s.points.seat_origin, seat) end),
      axes = computed(function(name) return axes_in_seat(s.axes[name], seat) end),
    }
    return computed(function(name) return name == "start" and state_in_seat(s.start) or fields[name] or s[name] end)
  end

  -- ---- Rows and forces ----

  for name, f in pairs(plain) do
    if type(f) == "function" and name ~= "model" then
      rd[name] = function(first, ...) return f(seated(first), ...) end
    end
  end
  for _, name in ipairs { "position", "velocity", "acceleration" } do
    rd[name] = function(row)
      local copy, residual = seated(row), row.residual and "residual" or 1
      copy[residual] = factor * row[residual]
      return plain[name](copy)
    end
  end
  for _, name in ipairs { "force", "torque" } do
    rd[name] = function(entry)
      local copy = seated(entry)
      copy.axes = copy.axes or "seat"
      return plain[name](copy)
    end
  end
  function rd.orientation(entry)
    local copy, target = seated(entry), {}
    for _, turn in ipairs(turns) do target[#target + 1] = turn end
    local key = copy.target and "target" or 2
    for _, turn in ipairs(copy[key]) do target[#target + 1] = turn end
    copy[key] = target
    return plain.orientation(copy)
  end
  -- Rows in the ground's directions become planes of the second place, which are those of the seat in a plane mechanism.
  local loops = 0
  function rd.loop(entry)
    local copy = seated(entry)
    loops = loops + 1
    if not copy.keep then return plain.loop(copy) end
    local rows, b = {}, copy.b or copy[2]
    local name, on = copy.name or "loop " .. loops, type(b) == "table" and b or { on = b }
    for axis in (type(copy.keep) == "table" and table.concat(copy.keep, " ") or copy.keep):gmatch "[xyz]" do
      rows[#rows + 1] = plain.on_plane { copy.a or copy[1], { on = on.on, at = on.at, along = on.along, turn = on.turn, direction = axis },
                                         alpha = copy.alpha, beta = copy.beta, name = name .. " " .. axis }
    end
    return rows
  end

  function rd.model(m)
    local links = {}
    if base == "fixed" then
      links[1] = { "seat", turn = turns }
    else
      links[1] = { "tilted", turn = turns }
      links[2] = { "seat_base", on = "tilted", joint = { "psi", "theta" }, mass = 20, center = { 0.1, 0.05, 0.02 },
                   inertia = { xx = 20, yy = 30, zz = 25 }, start = { psi = 0.3, theta = 0.2 }, start_rate = { psi = 0.5, theta = -0.4 } }
      links[3] = { "seat", on = "seat_base", at = { 0.1, 0.2, -0.1 }, turn = { { "x", 0.4 }, { "z", -0.7 } } }
    end
    for _, link in ipairs(m.links) do
      if link.on == nil or link.on == "ground" then link.on = "seat" end
      links[#links + 1] = link
    end
    m.links = links
    if m.gravity then m.gravity = turned(m.gravity) end
    local points = seated(m.points or {})
    points.seat_origin = { on = "seat" }
    m.points = points
    for _, name in ipairs { "forces", "states", "courses", "limits", "constraints", "events" } do
      local f = m[name]
      if f then m[name] = function(s) return f(state_in_seat(s)) end end
    end
    if base == "driven" then
      local rows = m.constraints
      m.dependent = nil
      m.constraints = function(s)
        return { rows and rows(s) or {}, plain.drive { "seat_base_psi", 0.3 + plain.sin(0.5 * s.t) },
                 plain.drive { "seat_base_theta", 0.2 - 0.4 * plain.sin(s.t) } }
      end
    end
    if m.drives then m.drives = seated(m.drives) end
    return plain.model(m)
  end
end
