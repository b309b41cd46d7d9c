-- The Puma of models/puma.lua with a motor at each axis in place of the rows of its programme. docs/control-in-c.md controls it;
-- copy both files into one folder.
local rd = require "refdyn"
local name = rd.option("name", "robot")                                 -- two structures in one program need two names
for i = 1, 6 do rd.input("axis" .. i, 0, "N m") end

local model = rd.model
function rd.model(it)
  it.name, it.constraints = name, nil
  it.forces = function(s)
    local torques = {}
    for i = 1, 6 do torques["axis" .. i .. "_psi"] = s.inputs["axis" .. i] end
    return torques
  end
  return model(it)
end

return require "puma"
