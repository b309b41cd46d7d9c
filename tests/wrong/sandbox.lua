-- expect: 3: attempt to index a nil value (global 'os')
local rd = require "refdyn"
os.remove("model")
