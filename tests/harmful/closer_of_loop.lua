-- expect: 4: setmetatable: __close is not allowed in a model
-- Tries the same with the closing value of a loop.
local rd = require "refdyn"
local last = setmetatable({}, { __close = function() while true do end end })
for i in function() end, nil, nil, last do end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
