// Works on bricks. A message has the compiled module or a task; each task is answered by its number.
import { serve } from "./platform.js";
import { Decoders } from "./decoders.js";

let decoders;

serve((message, reply) => {
  if (message.module) {
    decoders = new Decoders(message.module);
    return;
  }
  try {
    const result = decoders.run(message);
    reply({ task: message.task, result }, [result.buffer]);
  } catch (error) {
    reply({ task: message.task, code: error.code ?? "bug", message: error.message });
  }
});
